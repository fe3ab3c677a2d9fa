"""Requests about links to vehicles and about forwarding partners, while the station runs.

`LinkRequests` is the entry: it answers with all rows (`LinkReporter`), adds, closes and re-rates links, and
`PartnerRequests` adds and closes partners. The request table calls them, and `recall` once at the start of a station.

What always holds: only the holder of control changes anything, every change is journalled by the request table and kept
by `records.link_store`, and a SIM station uses addresses of this machine only.
"""
