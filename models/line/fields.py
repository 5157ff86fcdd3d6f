"""Types of fields that the readers' models share."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

# JSON's numbers only: neither true nor "80" nor infinity.
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0.0)]
NotNegative = Annotated[Number, Field(ge=0.0)]
Pair = tuple[Number, Number]


class Strict(BaseModel):
    """A mapping that refuses keys it does not know, so that a misspelt one is not lost."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)
