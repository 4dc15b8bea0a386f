"""A recording in Rerun's viewer: robot and paths in space, beliefs, states, forces over time.

`showing` goes over the messages, `robot` draws a URDF and moves it, `paths` colors the ways by the
state, `rows` sends values in columns, `layout` arranges the views. Needs the extra `hmcs[rerun]`.
"""
