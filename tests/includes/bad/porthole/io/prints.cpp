// Two faults: it includes iostream and prints.
#include <iostream>
void shout() { std::cout << "loud\n"; }
