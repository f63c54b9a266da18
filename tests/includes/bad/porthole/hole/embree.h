// One fault: only trace may see Embree.
#include <embree3/rtcore.h>
