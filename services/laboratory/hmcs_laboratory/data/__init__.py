"""What studies are made on: synthetic gestemes and tasks, and human drawings; one place each."""
