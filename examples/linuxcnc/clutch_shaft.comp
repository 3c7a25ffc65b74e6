component clutch_shaft "A shaft that is computed, to try clutch_axis without a machine.";
pin in u32 code "Code of the converter.";
pin out s32 counts "Counts of the encoder.";
variable shaft_t shaft;
option singleton yes;
option no_convenience_defines yes;
function _ fp "Once a period.";
include "run.h";
include "shaft.h";
license "MIT OR Apache-2.0";
author "The clutch developers";
;;

#define FUNCTION(name) static void name(struct __comp_state *own, long period)
FUNCTION(_)
{
    long microseconds = period / 1000;
    shaft_convert(&own->shaft, (uint16_t)*own->code);
    while (microseconds-- > 0)
        shaft_move(&own->shaft);
    *own->counts = shaft_counts(&own->shaft, run_counts_per_rev);
}
