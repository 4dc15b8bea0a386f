"""What tests over a real router share: processes, a hand, somebody who watches."""
