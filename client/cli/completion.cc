// SPDX-License-Identifier: Apache-2.0
#include "client/cli/completion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <sstream>
#include <vector>

namespace dlcs::client {
namespace {

std::vector<const CLI::App*> CommandsOf(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<std::string> NamesOf(const std::vector<const CLI::App*>& commands) {
  std::vector<std::string> names;
  for (const CLI::App* command : commands) names.push_back(command->get_name());
  return names;
}

// The words that an option or a positional takes; none if it takes anything.
std::vector<std::string> WordsOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  std::vector<std::string> words;
  if (type.find('|') == std::string::npos) return words;
  // Units such as BYTES|MB|GB are no words.
  if (type.find_first_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ") != std::string::npos) return words;
  std::istringstream in(type.substr(0, type.find('=')));
  for (std::string word; std::getline(in, word, '|');) words.push_back(word);
  return words;
}

std::vector<std::string> FlagsOf(const CLI::App& command) {
  std::vector<std::string> flags;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
  }
  return flags;
}

// What may follow the command itself: its own commands, or the words of its first positional.
std::vector<std::string> FirstWordsOf(const CLI::App& command) {
  if (const auto commands = CommandsOf(command); !commands.empty()) return NamesOf(commands);
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional()) return WordsOf(*option);
  }
  return {};
}

std::string Bash(const CLI::App& app) {
  std::string values, firsts, flags;
  for (const CLI::App* command : CommandsOf(app)) {
    const std::string& name = command->get_name();
    for (const CLI::Option* option : command->get_options()) {
      const auto words = WordsOf(*option);
      if (words.empty() || option->get_positional()) continue;
      for (const std::string& flag : option->get_lnames()) {
        values += fmt::format("    \"{} --{}\") words='{}' ;;\n", name, flag, fmt::join(words, " "));
      }
    }
    if (const auto words = FirstWordsOf(*command); !words.empty()) {
      firsts += fmt::format("      {}) words='{}' ;;\n", name, fmt::join(words, " "));
    }
    flags += fmt::format("      {}) words='{}' ;;\n", name, fmt::join(FlagsOf(*command), " "));
  }
  const std::string commands = fmt::format("{}", fmt::join(NamesOf(CommandsOf(app)), " "));
  firsts += fmt::format("      help) words='{}' ;;\n", commands);
  return fmt::format(R"sh(_dlcs() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}} command=${{COMP_WORDS[1]}} words=
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W '{} help --help --version' -- "$current"))
    return
  fi
  case "$command $previous" in
{}  esac
  if [ -z "$words" ] && [ "$COMP_CWORD" -eq 2 ]; then
    case "$command" in
{}    esac
  fi
  if [ "${{current#-}}" != "$current" ]; then
    case "$command" in
{}    esac
  fi
  if [ -n "$words" ]; then
    COMPREPLY=($(compgen -W "$words" -- "$current"))
  else
    COMPREPLY=($(compgen -f -- "$current"))
  fi
}}
complete -o filenames -F _dlcs dlcs
)sh",
                     commands, values, firsts, flags);
}

// A string of fish.
std::string FishQuoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') result += '\\';
    result += c == '\n' ? ' ' : c;
  }
  return result + "'";
}

std::string Fish(const CLI::App& app) {
  std::string script = fmt::format("complete -c dlcs -n '__fish_seen_subcommand_from help' -f -a '{}'\n",
                                   fmt::join(NamesOf(CommandsOf(app)), " "));
  for (const CLI::App* command : CommandsOf(app)) {
    const std::string& name = command->get_name();
    script += fmt::format("complete -c dlcs -n __fish_use_subcommand -f -a {} -d {}\n", name,
                          FishQuoted(command->get_description()));
    const std::string here = fmt::format("complete -c dlcs -n '__fish_seen_subcommand_from {}'", name);
    if (const auto words = FirstWordsOf(*command); !words.empty()) {
      script += fmt::format("{} -f -a '{}'\n", here, fmt::join(words, " "));
    }
    for (const CLI::Option* option : command->get_options()) {
      const auto words = WordsOf(*option);
      std::string value = option->get_expected_min() > 0 ? " -r" : "";
      if (!words.empty()) value = fmt::format(" -x -a '{}'", fmt::join(words, " "));
      for (const std::string& flag : option->get_lnames()) {
        script += fmt::format("{} -l {}{} -d {}\n", here, flag, value, FishQuoted(option->get_description()));
      }
    }
  }
  return script;
}

}  // namespace

std::string CompletionScript(const CLI::App& app, const std::string& shell) {
  if (shell == "fish") return Fish(app);
  const std::string bash = Bash(app);
  return shell == "bash" ? bash : "autoload -U +X bashcompinit && bashcompinit\n" + bash;
}

}  // namespace dlcs::client
