#include "mc_nmpc.hpp"
#define DEFAULT_PARAMETERS 100.0f, 3.924f, 0.5f, 2.0f, 1.2f, -1000.0f, 1000.0f, -1000.0f, 1000.0f, -1000.0f, 1000.0f, 0.5f
