// How threads wait for each other between loops.
#pragma once

#include <string>

namespace corpuscle {

/// Threads that wait spin for a while before they sleep; as GNU's OpenMP run time comes, for so long that beside one other
/// busy process they take each other's cores and a run takes five to eight times as long. It reads how long from the
/// environment when it is loaded, before main, so this sets the variable and starts the program anew in this process. LLVM's
/// reads it later. Does nothing where the user has said how to wait, on one thread, and where it has been done.
void wait_briefly(char** argv);

/// The variable of the environment that is in force and its value, as "GOMP_SPINCOUNT=1000"; "default" if there is none.
std::string waiting_policy();

}  // namespace corpuscle
