"""The layered segment filter, the default recognizer: restart is inferred, not assumed.

`gestemes` scores every gesteme for every living segment start, with `alignment`, `senses` and
`exits`; `filter` moves the belief over (task state, segment start); `recognizer` is both in one
object; `learning`, with `gesteme_learning` and `variants`, learns them from labeled segments;
`checking` judges what a model file says; `kind` registers the recognizer.
"""
