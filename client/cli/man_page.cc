// SPDX-License-Identifier: Apache-2.0
#include "client/cli/man_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <sstream>
#include <utility>
#include <vector>

namespace dlcs::client {
namespace {

// The letters of the help that are not in ASCII, as groff, mandoc and every other roff know them.
const std::vector<std::pair<std::string, std::string>>& LetterNames() {
  static const std::vector<std::pair<std::string, std::string>> kNames = {
      {"Δ", "\\(*D"}, {"κ", "\\(*k"}, {"θ", "\\(*h"}, {"γ", "\\(*g"}, {"∫", "\\(is"}, {"⟂", "\\(pp"}};
  return kNames;
}

// `text` as roff prints it letter by letter. A point or an apostrophe at the begin of a line would be a request.
std::string RoffText(const std::string& text) {
  std::string escaped;
  bool begins_line = true;
  for (const char c : text) {
    if (begins_line && (c == '.' || c == '\'')) escaped += "\\&";
    begins_line = c == '\n';
    switch (c) {
      case '\\':
        escaped += "\\e";
        break;
      case '-':
        escaped += "\\-";  // a minus, which can be copied into a shell; without the backslash a hyphen
        break;
      case '\'':
        escaped += "\\(aq";
        break;
      case '`':
        escaped += "\\(ga";
        break;
      case '^':
        escaped += "\\(ha";
        break;
      case '~':
        escaped += "\\(ti";
        break;
      default:
        escaped += c;
    }
  }
  for (const auto& [letter, name] : LetterNames()) {
    for (std::size_t at = 0; (at = escaped.find(letter, at)) != std::string::npos; at += name.size()) {
      escaped.replace(at, letter.size(), name);
    }
  }
  return escaped;
}

// The words of `text` on one line.
std::string OneLine(const std::string& text) {
  std::istringstream in(text);
  std::string line;
  for (std::string word; in >> word;) line += (line.empty() ? "" : " ") + word;
  return line;
}

std::string UpperCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

// "\fB\-o\fR, \fB\-\-output\fR \fIFILE\fR".
std::string NamesOf(const CLI::Option& option) {
  std::string names;
  const auto add = [&names](const std::string& name) {
    names += (names.empty() ? "\\fB" : ", \\fB") + RoffText(name) + "\\fR";
  };
  for (const std::string& name : option.get_snames()) add("-" + name);
  for (const std::string& name : option.get_lnames()) add("--" + name);
  if (!option.nonpositional()) add(option.get_name(/*positional=*/true));
  const std::string value = option.get_type_name();
  const bool takes_value = option.get_expected_min() > 0 && !value.empty() && value != names;
  if (!takes_value || !option.nonpositional()) return names;
  std::string words;
  for (const char c : value) words += c == '|' ? "|\\:" : RoffText(std::string(1, c));  // may break behind each word
  return names + " \\fI" + words + "\\fR";
}

std::string Item(const CLI::Option& option) {
  return fmt::format(".TP\n{}\n{}\n", NamesOf(option), RoffText(OneLine(option.get_description())));
}

// Paragraphs of prose are filled; lines that are indented, or one of several after a line that ends with a colon, stay
// as they are.
std::string Footer(const std::string& text) {
  std::string page;
  bool as_is = false;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    const bool indented = line.starts_with("  ");
    if (indented != as_is) page += indented ? ".PP\n.nf\n" : ".fi\n";
    if (as_is && !indented && !line.empty()) page += ".PP\n";
    as_is = indented;
    page += line.empty() ? ".PP\n" : RoffText(line) + "\n";
  }
  return page + (as_is ? ".fi\n" : "");
}

// Paragraph marks of which another follows print nothing, and checkers complain.
std::string WithoutEmptyParagraphs(const std::string& page) {
  std::istringstream in(page);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) {
    const bool mark = line == ".PP" || line.starts_with(".SH") || line.starts_with(".SS") || line == ".TP";
    while (mark && !lines.empty() && lines.back() == ".PP") lines.pop_back();
    const bool after_head = !lines.empty() && (lines.back().starts_with(".SH") || lines.back().starts_with(".SS"));
    if (line == ".PP" && after_head) continue;
    lines.push_back(line);
  }
  while (!lines.empty() && lines.back() == ".PP") lines.pop_back();
  std::string text;
  for (const std::string& line : lines) text += line + '\n';
  return text;
}

// The footer without the exit codes, which all commands share and which have a section of their own.
std::string OwnFooter(const CLI::App& command, const std::string& exit_codes) {
  std::string footer = command.get_footer();
  if (const std::size_t at = footer.find(exit_codes); !exit_codes.empty() && at != std::string::npos) {
    footer.erase(at, exit_codes.size());
  }
  return footer;
}

std::string Command(const CLI::App& command, const std::string& path, const std::vector<std::string>& groups,
                    const std::string& exit_codes) {
  const std::string name = path + " " + command.get_name();
  const auto commands = command.get_subcommands([](const CLI::App*) { return true; });
  std::string usage = "\\fB" + RoffText(name) + "\\fR";
  if (!commands.empty()) usage += " \\fICOMMAND\\fR";
  std::string page = fmt::format(".SS \"{}\"\n", RoffText(name));
  std::string positionals;
  for (const CLI::Option* option : command.get_options()) {
    if (option->nonpositional()) continue;
    const std::string shown = "\\fI" + RoffText(option->get_name(/*positional=*/true)) + "\\fR";
    usage += option->get_required() ? " " + shown : " [" + shown + "]";
    positionals += Item(*option);
  }
  page += usage + " [\\fIOPTION\\fR]...\n.PP\n" + RoffText(OneLine(command.get_description())) + ".\n" + positionals;
  for (const std::string& group : groups) {
    const auto options = command.get_options(
        [&group](const CLI::Option* option) { return option->nonpositional() && option->get_group() == group; });
    std::string items;
    for (const CLI::Option* option : options) {
      if (option != command.get_help_ptr()) items += Item(*option);  // which every command has
    }
    if (!items.empty()) page += fmt::format(".PP\n{}:\n{}", RoffText(group), items);
  }
  page += ".PP\n" + Footer(commands.empty() ? OwnFooter(command, exit_codes) : "");
  for (const CLI::App* sub : commands) page += Command(*sub, name, groups, exit_codes);
  return page;
}

}  // namespace

std::string ManPage(const CLI::App& app, const std::vector<std::string>& groups) {
  // The exit codes are the last paragraph of the footer.
  const std::string footer = app.get_footer();
  const std::size_t last = footer.rfind("\n\n");
  const std::string exit_codes = last == std::string::npos ? "" : footer.substr(last + 2);
  const std::string name = app.get_name();
  // Neither stretched lines nor broken words: text is copied from this page.
  std::string page =
      fmt::format(".TH {} 1 \"\" \"{}\" \"User Commands\"\n.nh\n.ad l\n", UpperCase(name), RoffText(app.version()));
  page += fmt::format(".SH NAME\n{} \\- solve differential linear complementarity systems\n", name);
  page += fmt::format(".SH SYNOPSIS\n\\fB{}\\fR \\fICOMMAND\\fR [\\fIOPTION\\fR]...\n", name);
  page += ".SH DESCRIPTION\n" + RoffText(OneLine(app.get_description())) + "\n.PP\n" +
          Footer(footer.substr(0, last == std::string::npos ? footer.size() : last));
  page += ".SH COMMANDS\n";
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    page += Command(*command, name, groups, exit_codes);
  }
  page += ".SH \"EXIT STATUS\"\n" + Footer(exit_codes);
  return WithoutEmptyParagraphs(page);
}

}  // namespace dlcs::client
