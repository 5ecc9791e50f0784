"""All storms, in the order in which they are told of."""

import chaos_kit  # noqa: F401  (finds tests/support)
import process_storms  # noqa: F401
import network_storms  # noqa: F401
import machine_storms  # noqa: F401
import redis_storms  # noqa: F401
import real_storms  # noqa: F401
from storm_list import STORMS

__all__ = ["STORMS"]
