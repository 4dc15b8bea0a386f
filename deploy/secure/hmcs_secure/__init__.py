"""A closed cell: a certificate authority of its own, and a router that refuses everybody else."""
