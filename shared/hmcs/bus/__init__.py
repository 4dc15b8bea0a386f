"""The wire: what travels between processes, where and how. It knows no gestemes."""
