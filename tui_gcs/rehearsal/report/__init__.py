"""A flight as one HTML file: recorded from the bus, drawn as SVG, readable in any browser without a network."""
