#!/bin/sh
# Whether a job of Grid Engine, whose id is given, is running, success or failed. Without asking,
# the study would wait for ever for a job that the queue ended for its memory or time.
if state=$(qstat -j "$1" 2>/dev/null); then
    # What cannot start stays in the queue.
    case $state in
    *"error reason"*) echo failed ;;
    *) echo running ;;
    esac
    exit
fi
account=$(qacct -j "$1" 2>/dev/null)
# The books lag behind the queue.
if [ -z "$account" ]; then
    echo running
    exit
fi
# Ids start anew some day: the last entry counts.
echo "$account" | awk '{ found[$1] = $2 }
    END { print (found["failed"] == 0 && found["exit_status"] == 0) ? "success" : "failed" }'
