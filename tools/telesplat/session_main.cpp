// telesplat for container images: only the commands that ask and steer a running session, and keys. The whole launcher
// reads data sets and pictures, and its libraries take 400 MB.
#include "common/net/service.h"
#include "tools/telesplat/command.h"

int main(int argc, char** argv) {
  using namespace telesplat;
  return net::guarded_main([&] {
    const std::string about = "telesplat in a container: asks and tells a running session, and makes keys";
    return launcher::run_commands("telesplat", about, {launcher::control_command(), launcher::keys_command()},
                                  {argv + 1, argv + argc});
  });
}
