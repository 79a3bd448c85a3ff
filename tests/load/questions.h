// SPDX-License-Identifier: Apache-2.0
// The measurements of dlcs_load, one function each: they load a server, print figures, and return whether the server
// kept its promises.

#ifndef DLCS_TESTS_LOAD_QUESTIONS_H_
#define DLCS_TESTS_LOAD_QUESTIONS_H_

#include <string>
#include <vector>

namespace dlcs::load {

// Connections of clients that submit and watch are cut at random moments: is any event missing without a gap, or
// delivered twice, or the end not reported, or a job created twice?
struct CutsQuestion {
  int cuts = 1000;
  unsigned seed = 1;
  int watchers = 8;
};
bool AskCuts(const CutsQuestion& question);

// Many watchers of one solve, some of which do not read: how old are the events of the others, how much memory does the
// server use, and how much time of the engine?
struct WatchersQuestion {
  double seconds = 60;
  int watchers = 100;
  int stalled = 10;
  int interval_ms = 50;  // 0: every event
  double rate = 1000;    // iterates a second, about
};
bool AskWatchers(const WatchersQuestion& question);

// The server gets more work than it can do: does it continue at its full rate, are refusals useful, is a light user
// served beside a heavy one?
struct OverloadQuestion {
  double seconds = 60;
  double factor = 5;
};
bool AskOverload(const OverloadQuestion& question);

// How long after a stop is a solve, or an analysis, over?
struct StopsQuestion {
  std::vector<int> sizes = {4, 100, 500, 1000};
  int stops = 20;      // of each method and size
  double longest = 3;  // s; stops come at random times up to here
  std::string only;    // of the cases that contain this text
  unsigned seed = 1;
};
bool AskStops(const StopsQuestion& question);

// How long after a cancel that was sent to a server, and after a deadline, is a job over? So many of both.
bool AskServedStops(const StopsQuestion& question);

// Jobs are created, watched, cancelled, read and deleted, connections are made and lost, the server restarts now and
// then: does anything grow?
struct SoakQuestion {
  double minutes = 30;
  int lives = 3;       // of the server
  int pause_ms = 200;  // between rounds
  unsigned seed = 1;
};
bool AskSoak(const SoakQuestion& question);

}  // namespace dlcs::load

#endif  // DLCS_TESTS_LOAD_QUESTIONS_H_
