"""The links screen: what each link and each path of each vehicle carries and loses, and forwarding partners.

`LinksScreen` asks the station while it is shown, and not otherwise; `LinkEdits` adds, closes and re-rates links.

Not here: the requests (`feed/link_watch.py`), drawing (`widgets/links`).
"""
