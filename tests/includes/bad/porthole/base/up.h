// Two faults: base includes a later folder, and a file that is not there.
#include "porthole/base/missing.h"
#include "porthole/hole/embree.h"
