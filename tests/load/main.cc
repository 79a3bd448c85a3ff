// SPDX-License-Identifier: Apache-2.0
// dlcs_load: measures a server under load, broken connections and over time. README.md has measured figures.

#include "CLI/CLI.hpp"
#include "spdlog/spdlog.h"
#include "tests/load/questions.h"

int main(int argc, char** argv) {
  using namespace dlcs::load;
  CLI::App app("Asks a real dlcsd whether it holds, and prints what it saw.", "dlcs_load");
  app.require_subcommand(1);
  app.option_defaults()->always_capture_default();
  app.footer(
      "Exit status: 0 when what is promised held, 1 when it did not. Ages and rates are printed and not judged: they "
      "are the machine's too.");
  bool held = true;

  CutsQuestion cuts;
  CLI::App* command = app.add_subcommand(
      "cuts", "Connections of clients are cut: is an event missing, or a job or an event there twice?");
  command->add_option("--cuts", cuts.cuts, "How many");
  command->add_option("--seed", cuts.seed, "Of their moments and kinds");
  command->add_option("--watchers", cuts.watchers, "At the same time");
  command->callback([&] { held = AskCuts(cuts); });

  WatchersQuestion watchers;
  command =
      app.add_subcommand("watchers", "Many watch one solve, some without reading: ages, memory, the engine's time");
  command->add_option("--seconds", watchers.seconds, "Of the solve, about");
  command->add_option("--watchers", watchers.watchers, "In all");
  command->add_option("--stalled", watchers.stalled, "Of these, without reading");
  command->add_option("--interval-ms", watchers.interval_ms, "What each asks for; 0: every event");
  command->add_option("--rate", watchers.rate, "Iterates a second, about");
  command->callback([&] { held = AskWatchers(watchers); });

  OverloadQuestion overload;
  command = app.add_subcommand("overload", "More is asked than can be done: goodput, refusals, a light user");
  command->add_option("--seconds", overload.seconds, "Of overload");
  command->add_option("--factor", overload.factor, "Asked, of what can be done");
  command->callback([&] { held = AskOverload(overload); });

  StopsQuestion stops;
  const auto take_stops = [&stops](CLI::App& of) {
    of.add_option("--sizes", stops.sizes, "Numbers of states and pairs");
    of.add_option("--stops", stops.stops, "Of each");
    of.add_option("--longest", stops.longest, "Seconds within which the stop comes");
    of.add_option("--only", stops.only, "Cases whose name contains this");
    of.add_option("--seed", stops.seed, "Of the moments");
  };
  command =
      app.add_subcommand("stops", "How long after a stop a solve or an analysis is over, for each method and size");
  take_stops(*command);
  command->callback([&] { held = AskStops(stops); });
  command = app.add_subcommand("served-stops",
                               "How long after a cancel that was sent, and after its deadline, a job is over");
  take_stops(*command);
  command->callback([&] { held = AskServedStops(stops); });

  SoakQuestion soak;
  command = app.add_subcommand("soak", "Jobs and connections come and go for long: does anything grow?");
  command->add_option("--minutes", soak.minutes, "In all");
  command->add_option("--lives", soak.lives, "Of the server, which restarts in between");
  command->add_option("--pause-ms", soak.pause_ms, "Between rounds of everything");
  command->add_option("--seed", soak.seed, "Of what is done");
  command->callback([&] { held = AskSoak(soak); });

  spdlog::set_level(spdlog::level::off);
  CLI11_PARSE(app, argc, argv);
  return held ? 0 : 1;
}
