#!/bin/sh
# Checks whether Redis answers. While it reads its files, it answers LOADING.
REDISCLI_AUTH=$(cat /secrets/password) redis-cli ping 2>&1 | grep -qx PONG
