#!/bin/sh
# The interpreter for `clutch hil`, as CLUTCH_PYTHON: it keeps what passes between the host and the chip's model in the
# files requests and answers of the folder $RECORD, for replay.mjs.
tee "$RECORD/requests" | "${PYTHON:-python3}" "$@" | tee "$RECORD/answers"
