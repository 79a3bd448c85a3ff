// SPDX-License-Identifier: Apache-2.0
#include "client/cli/server_options.h"

namespace dlcs::client {

void AddServer(CLI::App& app, ServerTarget& target, const std::string& help) {
  CLI::Option* const server =
      app.add_option_function<std::string>(
             "-s,--server",
             [&target](const std::string& address) {
               if (address.empty()) {
                 throw CLI::ValidationError("--server",
                                            "is empty; must be HOST:PORT. Is a variable of your script unset?");
               }
               target.address = address;
               target.typed = true;
             },
             help)
          ->type_name("HOST:PORT");
  CLI::Option* const context = app.add_option_function<std::string>(
                                      "--context",
                                      [&target](const std::string& name) {
                                        if (name.empty())
                                          throw CLI::ValidationError("--context", "is empty; must be a name");
                                        target.context = name;
                                      },
                                      "The server that has this name (dlcs context)")
                                   ->type_name("NAME")
                                   ->excludes(server);
  if (target.address.empty()) {
    app.add_flag("--local", target.local, "Run in this process; overrides DLCS_SERVER, DLCS_CONTEXT and contexts")
        ->excludes(server)
        ->excludes(context);
  }
  const auto file = [&app](const char* name, std::string& path, const char* what) {
    app.add_option(name, path, what)->type_name("FILE");
  };
  file("--token-file", target.token_file, "File with your token (default: the variable DLCS_TOKEN)");
  file("--tls-ca", target.tls_ca, "Encrypt; trust the authorities in this PEM file");
  app.add_flag("--tls", target.tls, "Encrypt; trust the authorities of this machine");
  file("--tls-cert", target.tls_cert, "Encrypt; your certificate, PEM, for servers that require one");
  file("--tls-key", target.tls_key, "Its private key, PEM");
}

}  // namespace dlcs::client
