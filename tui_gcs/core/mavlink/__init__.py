"""MAVLink on the wire: frames, messages, encoding. The only code that touches pymavlink's dialect tables."""
