#ifndef DECK_H
#define DECK_H

#include <stdbool.h>

bool deckGetRequiredKalmanEstimatorAttitudeReversionOff(void);

#endif
