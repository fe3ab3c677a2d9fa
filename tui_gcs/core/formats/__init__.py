"""Files of other programs: plans, drawings, parameters, read strictly and written so that those programs read them."""
