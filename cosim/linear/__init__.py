"""The linear map of a diagram over one step."""
