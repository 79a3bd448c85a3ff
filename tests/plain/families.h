// SPDX-License-Identifier: Apache-2.0
// The families of plain systems, each in units in which it is written down.

#ifndef DLCS_TESTS_PLAIN_FAMILIES_H_
#define DLCS_TESTS_PLAIN_FAMILIES_H_

#include "tests/plain/plain_parts.h"

namespace dlcs::plain {

// At rest, but for rounding.
PlainSystem BoxesOnSprings(Random& random);
PlainSystem BoxesOnFloors(Random& random);
PlainSystem NetworkAtItsOperatingPoint(Random& random);
PlainSystem Equilibrium(Random& random);
PlainSystem TankAtRest(Random& random);

// Symmetric, or nearly so: in a third of them one part is off by 3e-14 to 1e-8.
PlainSystem BalancedStar(Random& random);
PlainSystem SplitSupply(Random& random);
PlainSystem BalancedBridge(Random& random);
PlainSystem SwappedPair(Random& random);
PlainSystem DifferenceOfSensors(Random& random);
PlainSystem SumOfThreePhases(Random& random);

// Coordinates that were computed in doubles.
PlainSystem ModalCoordinates(Random& random);

// Parts that do not act back.
PlainSystem DecoupledAndZero(Random& random);
PlainSystem UnreachedStates(Random& random);
PlainSystem SmallParts(Random& random);
PlainSystem FeeblyCoupledOscillators(Random& random);
PlainSystem GainsFromASmallSignal(Random& random);
PlainSystem Cascade(Random& random);
PlainSystem ChargeCounter(Random& random);

// Cancellation that rounding spoils, sooner or later.
PlainSystem GainOfADifference(Random& random);
PlainSystem GrowthOfADifference(Random& random);
PlainSystem NearlyEqualDecays(Random& random);
PlainSystem ClosedSwitches(Random& random);
PlainSystem CoilsAtAStrayNode(Random& random);
PlainSystem DenseSystem(Random& random);

// With events.
PlainSystem BoxDropsOnFloor(Random& random);
PlainSystem RectifierBesideBalancedPart(Random& random);
PlainSystem RectifierFeedsBridge(Random& random);
PlainSystem StopBesideRest(Random& random);
PlainSystem RelayBesideRest(Random& random);
PlainSystem FrictionThatSticks(Random& random);

}  // namespace dlcs::plain

#endif  // DLCS_TESTS_PLAIN_FAMILIES_H_
