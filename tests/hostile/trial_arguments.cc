// SPDX-License-Identifier: Apache-2.0
#include "tests/hostile/trial_arguments.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

namespace dlcs::hostile {

std::optional<SeedRange> ReadSeeds(const std::string& text) {
  const size_t colon = text.find(':');
  if (colon == std::string::npos) return std::nullopt;
  return SeedRange{std::strtoull(text.c_str(), nullptr, 10), std::strtoull(text.c_str() + colon + 1, nullptr, 10)};
}

std::vector<Asked> ReadAsked(const std::string& list) {
  std::vector<Asked> result;
  std::istringstream items(list);
  for (std::string item; std::getline(items, item, ',');) {
    Asked asked;
    if (item.starts_with("steps=")) {
      asked.steps = std::strtol(item.c_str() + 6, nullptr, 10);
    } else if (item != "default") {
      asked.tolerance = std::strtod(item.c_str(), nullptr);
    }
    result.push_back(asked);
  }
  return result;
}

std::string Text(const Asked& asked) {
  if (asked.steps > 0) return "steps=" + std::to_string(asked.steps);
  if (asked.tolerance == 0) return "default";
  char text[20];
  std::snprintf(text, sizeof text, "%g", asked.tolerance);
  return text;
}

bool ReadArguments(int count, char** texts, const MoreOptions& more, TrialArguments& arguments) {
  MoreOptions all = more;
  all.flags["--verbose"] = &arguments.verbose;
  all.values["--seeds"] = [&](const std::string& value) {
    const std::optional<SeedRange> seeds = ReadSeeds(value);
    arguments.seeds = seeds.value_or(arguments.seeds);
    return seeds.has_value();
  };
  all.values["--tolerance"] = [&](const std::string& value) {
    arguments.asked = ReadAsked(value);
    return true;
  };
  all.values["--failures"] = [&](const std::string& value) {
    arguments.failures = value;
    return true;
  };
  all.values["--seconds"] = [&](const std::string& value) {
    arguments.seconds = std::strtod(value.c_str(), nullptr);
    return true;
  };
  for (int k = 1; k < count; ++k) {
    const std::string name = texts[k];
    if (const auto flag = all.flags.find(name); flag != all.flags.end()) {
      *flag->second = true;
      continue;
    }
    const auto option = all.values.find(name);
    if (option == all.values.end() || ++k >= count || !option->second(texts[k])) return false;
  }
  return true;
}

void WriteFailure(const TrialArguments& arguments, uint64_t seed, const System& system) {
  if (arguments.failures.empty()) return;
  std::ofstream(arguments.failures + "/" + std::to_string(seed) + ".json") << ToJson(system);
}

void PrintSeeds(const char* what, const std::vector<uint64_t>& seeds) {
  if (seeds.empty()) return;
  std::printf("  %s:", what);
  for (const uint64_t seed : seeds) std::printf(" %llu", static_cast<unsigned long long>(seed));
  std::printf("\n");
}

}  // namespace dlcs::hostile
