"""The page that every FMU carries: its plant's variables, equations and events, readable."""

from .page import documentation_page

__all__ = ["documentation_page"]
