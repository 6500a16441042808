#!/bin/sh
# A queue of this machine for tests: notes what was asked for, runs the job, prints its number.
# Usage: local_queue.sh NOTES THREADS MEMORY_MB MINUTES SCRIPT
notes=$1
echo "$2 threads, $3 MB, $4 min" >> "$notes"
(setsid --wait sh "$5" > "$notes.$$.log" 2>&1; echo $? > "$notes.$$.code") > /dev/null &
echo $$
