"""An arm as its URDF describes it, without any physics engine.

`urdf` reads the file, `chain` makes the arm of the joints between base and tool, `prepared` writes
what an engine or a page loads, `meshes` finds the files it names, `checking` says what an arm can
do, `picture` draws it.
"""
