// Two faults: base includes a later folder, and a file that is not there.
#include "porthole/hole/embree.h"
#include "porthole/base/missing.h"
