"""`python -m tui_gcs` is `tui-gcs`, for where scripts are not on the PATH."""

import sys

from tui_gcs.cli.main import main

sys.exit(main())
