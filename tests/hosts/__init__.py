"""Several hosts, for real: network namespaces with links that are slow, lossy, cut and healed."""
