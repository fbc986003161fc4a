"""Two controllers in, and what differs between them in control terms out."""
