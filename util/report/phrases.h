// Phrases that the report of a job, the terminal and the dashboard have in common. The dashboard reads them
// from web/static/js/phrases.js, which texts_test.cpp writes from this table.
#pragma once

#include <array>
#include <string_view>

namespace ls::report {

struct Phrase {
  std::string_view key;  // name of the phrase in C++ and JavaScript
  const char* text;
};
inline constexpr std::array kPhrases{
    // Phrases on doubt about the error estimate:
    Phrase{"doubt", "don't trust yet"},
    Phrase{"estimateInDoubt", "This error estimate can't be trusted yet."},
    Phrase{"noIntervals", "No intervals are shown: the estimate can't be trusted yet."},
    Phrase{"noPointYet", "The first point appears when every tile has finished a round of samples."},
    Phrase{"independentSamples", "independent samples give −1"},
    // Phrases on errors against a reference image:
    Phrase{"againstReference", "against the reference"},
    Phrase{"belowNoise", "below the reference's noise"},
    Phrase{"oneSeed", "not to be trusted: one seed"},
    Phrase{"sameSeed",
           "The reference shares this job's seed: its noise is the same noise, and the true figures say "
           "nothing. "
           "Render it with another --seed."},
    // Why a job ended (the report's field `stopped`), and headings for errors:
    Phrase{"stoppedSpp", "all its samples are in"},
    Phrase{"stoppedError", "the target error is reached"},
    Phrase{"stoppedErrorDenoised", "the target error of the denoised layers is reached"},
    Phrase{"stoppedErrorInDoubt", "the target error is reached by its own estimate: don't trust yet"},
    Phrase{"stoppedTime", "its time was up"},
    Phrase{"stoppedUser", "someone stopped it"},
    Phrase{"failed", "The job failed"},
    Phrase{"unwell", "Something is wrong"},
    // Where the time was spent (the report's field `time`): how the time is measured, and one phrase for each
    // member of the field.
    Phrase{"timeUnit", "Seconds of threads: of render their CPU time, of the others by the clock."},
    Phrase{"timeLoad", "getting the files that the scene names"},
    Phrase{"timeBuild", "reading them and building the world"},
    Phrase{"timeRender", "tracing"},
    Phrase{"timeTransfer", "packing results to be sent"},
    Phrase{"timeMerge", "folding and measuring, in the coordinator"},
    Phrase{"timeIdle", "threads between two units of the job"},
};

// Returns the phrase with this key. If the table lacks the key, the call does not compile.
consteval const char* phrase(std::string_view key) {
  for (const Phrase& p : kPhrases)
    if (p.key == key) return p.text;
  throw "the table of phrases has no such key";
}

}  // namespace ls::report
