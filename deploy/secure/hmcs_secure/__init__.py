"""A closed cell: its own certificate authority, and a router that admits only its certificates.

Open `command` first: the commands `hmcs secure …`. `authority` issues certificates, `access` makes
the router's rules from the table of rights, `closed_cell` names the certificate of each process.
"""
