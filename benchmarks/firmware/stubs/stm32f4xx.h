#include "stm32fxxx.h"
