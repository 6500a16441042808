#!/bin/sh
# What became of a job of local_queue.sh. Usage: local_status.sh NOTES NUMBER
case $(cat "$1.$2.code" 2>/dev/null) in
"") echo running ;;
0) echo success ;;
*) echo failed ;;
esac
