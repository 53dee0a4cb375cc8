// Runs a fuzz target over the files of a corpus, and over each of them damaged in a few ways, as an ordinary test. An
// input that ends the program is left in the file damaged-input.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace {

using Bytes = std::vector<uint8_t>;

// The input that the target runs on; keep_input() writes it if it ends the program.
const Bytes* at_hand = nullptr;

extern "C" void keep_input(int signal) {
  if (at_hand) {
    const int file = open("damaged-input", O_CREAT | O_TRUNC | O_WRONLY, 0644);
    if (file >= 0 && write(file, at_hand->data(), at_hand->size()) >= 0) close(file);
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

// Changes bits, bytes and numbers; leaves out, doubles or inserts parts, also from another file.
Bytes damaged(Bytes bytes, const Bytes& other, std::mt19937& random) {
  const auto below = [&](size_t n) { return n == 0 ? 0 : size_t(random()) % n; };
  for (size_t n = 1 + below(4); n-- > 0;) {
    const size_t at = below(bytes.size());
    switch (below(8)) {
      case 0:
        if (!bytes.empty()) bytes[at] ^= uint8_t(1u << below(8));
        break;
      case 1:
        if (!bytes.empty()) bytes[at] = uint8_t(random());
        break;
      case 2:
        for (size_t i = at; i < std::min(bytes.size(), at + (size_t{1} << below(4))); ++i)
          bytes[i] = below(2) ? 255 : 0;
        break;
      case 3:
        bytes.resize(at);
        break;
      case 4:
        bytes.erase(bytes.begin() + ptrdiff_t(at),
                    bytes.begin() + ptrdiff_t(std::min(bytes.size(), at + 1 + below(9))));
        break;
      case 5: {
        const Bytes part(bytes.begin() + ptrdiff_t(at),
                         bytes.begin() + ptrdiff_t(std::min(bytes.size(), at + below(40))));
        bytes.insert(bytes.begin() + ptrdiff_t(below(bytes.size())), part.begin(), part.end());
        break;
      }
      case 6:
        bytes.insert(bytes.begin() + ptrdiff_t(at), uint8_t(random()));
        break;
      default:
        if (!other.empty())
          bytes.insert(bytes.begin() + ptrdiff_t(at), other.begin() + ptrdiff_t(below(other.size())), other.end());
    }
  }
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<Bytes> files;
  for (int i = 1; i < argc; ++i)
    for (const auto& entry : std::filesystem::recursive_directory_iterator(argv[i])) {
      if (!entry.is_regular_file()) continue;
      std::ifstream in(entry.path(), std::ios::binary);
      files.push_back({std::istreambuf_iterator<char>(in), {}});
    }
  std::sort(files.begin(), files.end());
  for (const Bytes& bytes : files) LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE}) std::signal(signal, keep_input);
  // TELESPLAT_DAMAGED: number of damaged inputs made of all files together, the same ones every time.
  const char* wanted = std::getenv("TELESPLAT_DAMAGED");
  const size_t most = wanted ? std::strtoull(wanted, nullptr, 10) : 200;
  std::mt19937 random(1);
  size_t made = 0;
  for (; made < most && !files.empty(); ++made) {
    const Bytes bytes = damaged(files[made % files.size()], files[random() % files.size()], random);
    at_hand = &bytes;
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
    at_hand = nullptr;
  }
  std::printf("%zu inputs, %zu damaged ones\n", files.size(), made);
  return files.empty() ? 1 : 0;  // a missing corpus is a mistake
}
