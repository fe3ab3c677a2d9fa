"""The station's core: no Textual anywhere below this package."""
