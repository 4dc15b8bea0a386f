"""The layered segment filter, the default recognizer: it infers when each gesteme began.

A *gesteme* is a motion primitive: one meaningful piece of motion. Open `recognizer` first: it joins
`gestemes`, which scores every gesteme for every segment start still possible (with `alignment`,
`senses` and `exits`), and `filter`, which moves the belief over (task state, segment start).
`learning`, with `gesteme_learning` and `variants`, learns both from labeled segments; `checking`
checks the contents of a model file; `kind` registers the recognizer.
"""
