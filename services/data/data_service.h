// The data server process (T5.2.1): opens the data set, says hello, answers samplers' requests.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/net/turns.h"
#include "services/data/data_options.h"
#include "services/data/served.h"

namespace telesplat::data {

/// Returns the hello that describes the data set to the session; all of its text is UTF-8, even if a file's name is
/// not. endpoint: address for requests; empty: no requests.
wire::Hello make_hello(const Served& served, const std::string& name, const std::string& endpoint);

/// Additions to the record of a run: facts, and files whose size and hash follow when they are known.
struct Recorded {
  std::map<std::string, std::string> facts;
  std::vector<std::string> files;
};

/// The serving process: says hello, answers until told to stop, and says goodbye.
class DataService : public net::Turns {
 public:
  /// Binds its socket. Error: it cannot be bound. Context and `served` must outlive the service.
  static Result<std::unique_ptr<DataService>> open(net::Context& context, Served& served,
                                                   const net::ServiceOptions& options, const Recorded& recorded = {},
                                                   std::function<bool()> stop = {});
  virtual int exit_code() const = 0;
};

/// Serves until told to stop, or until `stop` returns true. Exit code: 0, or 2 if its socket cannot be bound.
int serve(net::Context& context, Served& served, const net::ServiceOptions& options, const std::function<bool()>& stop,
          const Recorded& recorded = {});

/// Opens the data set and serves it until told to stop. Exit code: 0, or 2 if the data cannot be read (one line on
/// stderr says why).
Result<int> run(const DataServiceOptions& options);

}  // namespace telesplat::data
