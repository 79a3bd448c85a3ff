// SPDX-License-Identifier: Apache-2.0
// The text of `--help` below the options.

#ifndef DLCS_CLIENT_CLI_HELP_TEXT_H_
#define DLCS_CLIENT_CLI_HELP_TEXT_H_

namespace dlcs::client {

inline constexpr const char* kExitCodes =
    "Exit codes: 0 solved; 1 there is no solution, or none was found within the allowed error (the\n"
    "result says which); 2 bad input (file, option, problem); 3 the service failed, or the solve was cancelled\n"
    "there or ran out of time; 130 Ctrl-C, 143 SIGTERM.";

inline constexpr const char* kEnsembleExitCodes =
    "Exit codes: 0 all members solved; 1 some have no solution; 2 bad input (file, option,\n"
    "problem, member); 3 the service failed, or members were cancelled there or ran out of time; 130 Ctrl-C,\n"
    "143 SIGTERM.";

inline constexpr const char* kMainExamples =
    "Examples:\n"
    "  dlcs solve circuit.json                            solve here, print a table\n"
    "  dlcs solve circuit.json --server localhost:50051   the same on a server (start one with dlcsd)\n"
    "  dlcs ensemble circuit.json starts.json             the same system for many initial states\n"
    "  dlcs analyze circuit.json                          what is known before solving, and how to solve\n"
    "  dlcs lcp lcp.json                                  one linear complementarity problem\n"
    "  dlcs dcp dcp.json                                  one dynamic complementarity problem\n"
    "  dlcs model input-output economy.json               a problem file from a model\n"
    "  dlcs netlist circuit.cir                           a problem file from a SPICE deck\n"
    "  dlcs submit circuit.json                           a job on a server, which survives this terminal\n"
    "  dlcs help solve                                    all options, more examples\n"
    "\n"
    "DLCS_SERVER=HOST:PORT, DLCS_CONTEXT=NAME or `dlcs context use NAME` replace --server; --local overrides them.";

inline constexpr const char* kSolveExamples =
    "A problem file is one JSON object with the keys A B N M x0 T and f and g (or pieces), of\n"
    "    x' = A x + B y + f(t),  0 <= y, N x + g(t) + M y >= 0 complementary,  x(0) = x0,  t in [0, T]\n"
    "as in\n    {\"A\": [[-1]], \"B\": [[1]], \"N\": [[1]], \"M\": [[1]], \"x0\": [0], \"T\": 5, \"f\": "
    "[\"sin(t)\"],\n     \"g\": [\"-1\"]}\n"
    "With \"kind\": \"nonlinear\" it holds f, g, x0 and T of\n"
    "    x' = f(t, x, y),  0 <= y, g(t, x, y) >= 0 complementary,  x(0) = x0,  t in [0, T]\n"
    "as in\n"
    "    {\"kind\": \"nonlinear\", \"f\": [\"-x1**3+y1\"], \"g\": [\"x1+y1-sin(t)\"], \"x0\": [1], \"T\": "
    "5}\n"
    "An .npz or .mat file (of save -v7) with the variables A B N M x0 T, and f and g where they are constants, is\n"
    "a problem file too.\n"
    "\n"
    "Examples:\n"
    "  dlcs solve circuit.json --steps 100000\n"
    "  dlcs solve circuit.json --tolerance 1e-8 --at 1,2.5\n"
    "  dlcs solve circuit.json --method time-stepping --step 1e-4 --project-initial-state\n"
    "  dlcs solve circuit.json --at 0.5,1,2 --format json --quiet\n"
    "  dlcs solve circuit.json --grid nodes.txt\n"
    "  dlcs solve circuit.json --output circuit.csv --server localhost:50051\n"
    "  dlcs solve circuit.mat --output result.mat         .csv .json .npy .npz .h5 .hdf5 .mat: the ending chooses\n"
    "  dlcs solve circuit.json --plot circuit.svg         a table, and a picture\n"
    "  dlcs solve circuit.json --server solver.example:50051 --tls-ca ca.pem --token-file me.token\n"
    "  generate | dlcs solve - --window whole --format json\n"
    "\n"
    "Ctrl-C and SIGTERM cancel the solve and print the part solved so far; a file is then named FILE.partial. A second "
    "one\n"
    "ends the program at once. On a terminal a panel shows the progress; --verbose prints every iterate.";

inline constexpr const char* kContextExamples =
    "A context is a name for a server and the options of its connection. Tokens stay in their files.\n"
    "--server takes precedence, then --context, DLCS_SERVER, DLCS_CONTEXT and the context in use.\n"
    "\n"
    "Examples:\n"
    "  dlcs context set lab --server solver.example:50051 --tls-ca ca.pem --token-file me.token\n"
    "  dlcs context use lab               from now on\n"
    "  dlcs solve circuit.json            runs there\n"
    "  dlcs solve circuit.json --local    runs here\n"
    "  dlcs context use                   no current context";

inline constexpr const char* kEnsembleExamples =
    "MEMBERS is a list of objects, each with what its member replaces in the problem: x0, f, g, pieces, T,\n"
    "break_points, and a label, as in\n"
    "    [{\"x0\": [1, 0]}, {\"x0\": [2, 0], \"T\": 3, \"label\": \"far\"}]\n"
    "or a table with one initial state per line:\n"
    "    x1,x2\n"
    "    1,0\n"
    "    2,0\n"
    "Everything that depends on the matrices alone is computed once. One member per thread is solved at\n"
    "the same time.\n"
    "\n"
    "Examples:\n"
    "  dlcs ensemble circuit.json starts.csv --tolerance 1e-8\n"
    "  dlcs ensemble circuit.json sources.json --steps 10000 --server localhost:50051\n"
    "  dlcs ensemble circuit.json starts.csv --at 1,2 --format json --output solved.jsonl\n"
    "  dlcs ensemble circuit.json starts.csv --detach\n"
    "  dlcs ensemble circuit.json starts.csv --detach --extrema --deadline 3600\n"
    "\n"
    "Ctrl-C and SIGTERM cancel the running members and print the results so far; a second one ends at once.";

inline constexpr const char* kAnalyzeExamples =
    "Reports what is known about the system before it is solved: the class of M with witnesses, constants,\n"
    "warnings, and the command that solves it. The options are those that you have decided on.\n"
    "\n"
    "Examples:\n"
    "  dlcs analyze circuit.json\n"
    "  dlcs analyze circuit.json --method time-stepping --step 1e-3 --format json";

inline constexpr const char* kLcpExamples =
    "Finds y with 0 <= y, w = q + M y >= 0, y complementary to w. The file holds one JSON object, as in\n"
    "    {\"M\": [[2, 1], [1, 2]], \"q\": [-5, -6]}\n"
    "and may hold a \"rule\" (as --rule) and, for the rule minimizer, a \"selector\" with C and b.\n"
    "\n"
    "Examples:\n"
    "  dlcs lcp lcp.json\n"
    "  dlcs lcp lcp.json --rule least-norm --format json\n"
    "  dlcs lcp lcp.json --all";

inline constexpr const char* kDcpExamples =
    "Finds v, nondecreasing with v(0) = 0, such that w = q + M v >= 0 and the integral of w_i dv_i is 0\n"
    "for all i, by time stepping. q is linear between nodes; a time that occurs twice is a jump. As in\n"
    "    {\"M\": [[1, 3, 0], [0, 1, 3], [3, 0, 1]],\n"
    "     \"q\": {\"times\": [0, 1], \"values\": [[0, 0, 0], [-1, -1, -1]]}}\n"
    "\n"
    "Examples:\n"
    "  dlcs dcp dcp.json --step 1e-3\n"
    "  dlcs dcp dcp.json --check v.json";

inline constexpr const char* kModelExamples =
    "Prints a problem file, and on standard error what is known of the model. `input-output` is the\n"
    "dynamic economy x' = A x + B y + f(t), 0 <= y, (I - C) y - x >= 0 complementary, x(0) = d, as in\n"
    "    {\"C\": [[0.2]], \"A\": [[-1]], \"B\": [[0.5]], \"d\": [1], \"T\": 5, \"f\": [\"1+sin(t)\"]}\n"
    "The others are fields on a grid, and keep their structure: `signorini` is the membrane of Wu & Chen on\n"
    "a square or a cube, `obstacle` a string or a membrane above an obstacle, `american-option` a put on one\n"
    "or two assets, `drainage` ground water between drains that give nothing back. `heat` is heat in the body\n"
    "of a mesh of Gmsh (MSH 2.2 or 4.1, ASCII), by linear finite elements, with a mass matrix: the groups\n"
    "--contact of its surface touch a wall that keeps u from falling below 0.\n"
    "\n"
    "Examples:\n"
    "  dlcs model signorini --cells 256 --coefficient 0.2 --output membrane.json\n"
    "  dlcs model american-option --cells 40 --rate 0.1 | dlcs solve - --at 1\n"
    "  dlcs model heat body.msh --contact wall --load '-1' | dlcs solve - --at 1\n"
    "  dlcs model input-output economy.json --output problem.json\n"
    "  dlcs model input-output economy.json | dlcs solve -";

inline constexpr const char* kNetlistExamples =
    "Reads R, L, C, K, V, I, E, F, G, H and B (linear or piecewise linear), D, M (a switch with a body diode),\n"
    "S, W and X with .param, .func, .model, .subckt, .global, .include, .lib, .ic, .tran, .print, .plot,\n"
    ".probe, .save and .meas; `dlcs ensemble` solves the points of .step. What is not supported is refused with\n"
    "its line; what is ignored or assumed is printed on standard error. The problem file holds voltages of nodes\n"
    "and currents of elements as outputs. Numbers of options may have suffixes as in SPICE: 1m, 20u, 10k, 1meg.\n"
    "`dlcs solve DECK.cir` does both steps at once.\n"
    "\n"
    "Examples:\n"
    "  dlcs netlist buck.cir --output buck.json\n"
    "  dlcs netlist rectifier.cir --diode ideal | dlcs solve - --at 0:1m:20m\n"
    "  dlcs solve buck.cir --tolerance 1e-8 --output buck.csv";

inline constexpr const char* kCapabilitiesExamples =
    "Examples:\n"
    "  dlcs capabilities\n"
    "  dlcs capabilities --server localhost:50051 --format json";

inline constexpr const char* kPlotExamples =
    "Draws at most 12 curves in each panel, with gnuplot, and switching times as dotted lines. Curves join\n"
    "the times of the result: give the solve enough of them by --at begin:step:end.\n"
    "\n"
    "Examples:\n"
    "  dlcs solve deploy/examples/rectifier.json --at 0:0.005:2 --format json --output result.json\n"
    "  dlcs plot result.json --output result.svg\n"
    "  dlcs plot result.json --show x1,y1 --output result.svg\n"
    "  dlcs solve put.json --at 0,0.25,1 --format json | dlcs plot - --profile --show x --output put.png";

inline constexpr const char* kCompletionExamples =
    "Examples:\n"
    "  source <(dlcs completion bash)                                 # in .bashrc\n"
    "  source <(dlcs completion zsh)                                  # in .zshrc, after compinit\n"
    "  dlcs completion fish > ~/.config/fish/completions/dlcs.fish";

inline constexpr const char* kManExamples =
    "Examples:\n"
    "  dlcs man | man -l -\n"
    "  dlcs man > /usr/local/share/man/man1/dlcs.1        as `cmake --install` does";

inline constexpr const char* kHealthExamples =
    "Checks the server as a whole, which serves until it shuts down, or one of its services: dlcs.v1.SolverService,\n"
    "or dlcs.v1.JobService, which serves while its store answers. Needs no token.\n"
    "\n"
    "Examples:\n"
    "  dlcs health\n"
    "  dlcs health --service dlcs.v1.JobService --server solver.example:50051 --tls-ca ca.pem\n"
    "\n"
    "Exit codes: 0 SERVING; 1 the server answers but does not serve; 2 bad input (option, file); 3 no answer.";

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_HELP_TEXT_H_
