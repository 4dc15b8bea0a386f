"""An arm as its URDF describes it, without any physics engine.

`described` is all that file and task say of it, `prepared` writes what an engine or a page loads,
`meshes` finds the files it names, `checking` says what an arm can do, `picture` draws it.
"""
