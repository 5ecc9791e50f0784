#!/bin/sh
# Whether Redis answers (and has read its files: it says LOADING until then).
REDISCLI_AUTH=$(cat /secrets/password) redis-cli ping 2>&1 | grep -qx PONG
