"""Fields and forms: rows of one-line fields, choices, a prompt in a line, remarks below a form.

A `Form` of `FormRow` shows texts and posts texts; `form_text` converts them to numbers, points and ids, and back.
`PromptBar` is a question in one line. The forms of zones, teams and missions are built from these.

Always: text is plain, never markup. Enter, Tab and arrows go through fields in the order in which they are composed,
even before they are laid out. A letter is never silently dropped from a number.

Not here: what a field means, which the model behind each form decides.
"""
