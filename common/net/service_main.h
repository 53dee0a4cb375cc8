// The main() of every service program: parses the configuration, serves until a stop is requested.
#pragma once

#include "common/core/version.h"
#include "common/net/service.h"
#include "common/options/complain.h"
#include "common/options/parser.h"

namespace telesplat::net {

/// table(options) returns the rows of all flags; run(options) serves and returns the exit code (Result<int>). Bad usage
/// and run's error become one line and exit code 2; an uncaught exception one line and exit code 1.
template <class Options>
int service_main(int argc, char** argv, const char* about, Options options,
                 telesplat::options::Table (*table)(Options&), auto run) {
  end_on_signals();  // until run() looks at the flag
  raise_file_limit();
  return guarded_main([&] {
    telesplat::options::Parser parser{about};
    parser.add(table(options));
    parser.version(version());
    parser.parse_or_exit(argv[0], {argv + 1, argv + argc});
    const bool connects = telesplat::options::find(table(options), "--master") != nullptr;
    if (const int code = settle_master(options.service, connects)) return code;
    const Result<int> code = run(options);
    return code ? *code : complain(code.error());
  });
}

}  // namespace telesplat::net
