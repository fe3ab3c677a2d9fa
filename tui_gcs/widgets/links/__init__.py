"""The widgets of the links screen: lists of links, of paths and of partners, and a panel of details.

Always: addresses and texts are drawn as text, never as markup. Not here: keys and requests (`screens/links`), rates
(`feed/link_watch.py`).
"""
