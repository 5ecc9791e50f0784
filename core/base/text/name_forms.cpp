#include "core/base/text/name_forms.h"

#include <algorithm>
#include <system_error>

namespace ls {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxNamesLookedAt = 4096;  // in one folder

struct Mark {
  char32_t mark;                // the accent, which follows its letter
  std::u32string_view letters;  // each letter that can have it, followed by the letter with the accent
};
// The pairs that Unicode 15 composes (its character database, Decomposition_Mapping), by accent.
// clang-format off
constexpr Mark kMarks[] = {
    {U'\u0300',
     U"AÀEÈIÌOÒUÙaàeèiìoòuùÜǛüǜNǸnǹЕЀИЍеѐиѝĒḔēḕŌṐōṑWẀwẁÂẦâầĂẰăằÊỀêềÔỒôồƠỜơờƯỪưừYỲyỳἀἂἁἃ"
     U"ἈἊἉἋἐἒἑἓἘἚἙἛἠἢἡἣἨἪἩἫἰἲἱἳἸἺἹἻὀὂὁὃὈὊὉὋὐὒὑὓὙὛὠὢὡὣὨὪὩὫαὰεὲηὴιὶοὸυὺωὼΑᾺΕῈΗῊ᾿῍ϊῒΙῚ῾῝ϋῢ"
     U"ΥῪ¨῭ΟῸΩῺ"},
    {U'\u0301',
     U"AÁEÉIÍOÓUÚYÝaáeéiíoóuúyýCĆcćLĹlĺNŃnńRŔrŕSŚsśZŹzźÜǗüǘGǴgǵÅǺåǻÆǼæǽØǾøǿ¨΅ΑΆΕΈΗΉΙΊΟΌ"
     U"ΥΎΩΏϊΐαάεέηήιίϋΰοόυύωώϒϓГЃКЌгѓкќÇḈçḉĒḖēḗÏḮïḯKḰkḱMḾmḿÕṌõṍŌṒōṓPṔpṕŨṸũṹWẂwẃÂẤâấĂẮăắ"
     U"ÊẾêếÔỐôốƠỚơớƯỨưứἀἄἁἅἈἌἉἍἐἔἑἕἘἜἙἝἠἤἡἥἨἬἩἭἰἴἱἵἸἼἹἽὀὄὁὅὈὌὉὍὐὔὑὕὙὝὠὤὡὥὨὬὩὭ᾿῎῾῞"},
    {U'\u0302',
     U"AÂEÊIÎOÔUÛaâeêiîoôuûCĈcĉGĜgĝHĤhĥJĴjĵSŜsŝWŴwŵYŶyŷZẐzẑẠẬạậẸỆẹệỌỘọộ"},
    {U'\u0303',
     U"AÃNÑOÕaãnñoõIĨiĩUŨuũVṼvṽÂẪâẫĂẴăẵEẼeẽÊỄêễÔỖôỗƠỠơỡƯỮưữYỸyỹ"},
    {U'\u0304',
     U"AĀaāEĒeēIĪiīOŌoōUŪuūÜǕüǖÄǞäǟȦǠȧǡÆǢæǣǪǬǫǭÖȪöȫÕȬõȭȮȰȯȱYȲyȳИӢиӣУӮуӯGḠgḡḶḸḷḹṚṜṛṝαᾱΑᾹ"
     U"ιῑΙῙυῡΥῩ"},
    {U'\u0306',
     U"AĂaăEĔeĕGĞgğIĬiĭOŎoŏUŬuŭУЎИЙийуўЖӁжӂАӐаӑЕӖеӗȨḜȩḝẠẶạặαᾰΑᾸιῐΙῘυῠΥῨ"},
    {U'\u0307',
     U"CĊcċEĖeėGĠgġIİZŻzżAȦaȧOȮoȯBḂbḃDḊdḋFḞfḟHḢhḣMṀmṁNṄnṅPṖpṗRṘrṙSṠsṡŚṤśṥŠṦšṧṢṨṣṩTṪtṫWẆ"
     U"wẇXẊxẋYẎyẏſẛ"},
    {U'\u0308',
     U"AÄEËIÏOÖUÜaäeëiïoöuüyÿYŸΙΪΥΫιϊυϋϒϔЕЁІЇеёіїАӒаӓӘӚәӛЖӜжӝЗӞзӟИӤиӥОӦоӧӨӪөӫЭӬэӭУӰуӱЧӴ"
     U"чӵЫӸыӹHḦhḧÕṎõṏŪṺūṻWẄwẅXẌxẍtẗ"},
    {U'\u0309',
     U"AẢaảÂẨâẩĂẲăẳEẺeẻÊỂêểIỈiỉOỎoỏÔỔôổƠỞơởUỦuủƯỬưửYỶyỷ"},
    {U'\u030a',
     U"AÅaåUŮuůwẘyẙ"},
    {U'\u030b',
     U"OŐoőUŰuűУӲуӳ"},
    {U'\u030c',
     U"CČcčDĎdďEĚeěLĽlľNŇnňRŘrřSŠsšTŤtťZŽzžAǍaǎIǏiǐOǑoǒUǓuǔÜǙüǚGǦgǧKǨkǩƷǮʒǯjǰHȞhȟ"},
    {U'\u030f',
     U"AȀaȁEȄeȅIȈiȉOȌoȍRȐrȑUȔuȕѴѶѵѷ"},
    {U'\u0311',
     U"AȂaȃEȆeȇIȊiȋOȎoȏRȒrȓUȖuȗ"},
    {U'\u0313',
     U"αἀΑἈεἐΕἘηἠΗἨιἰΙἸοὀΟὈυὐωὠΩὨρῤ"},
    {U'\u0314',
     U"αἁΑἉεἑΕἙηἡΗἩιἱΙἹοὁΟὉυὑΥὙωὡΩὩρῥΡῬ"},
    {U'\u031b',
     U"OƠoơUƯuư"},
    {U'\u0323',
     U"BḄbḅDḌdḍHḤhḥKḲkḳLḶlḷMṂmṃNṆnṇRṚrṛSṢsṣTṬtṭVṾvṿWẈwẉZẒzẓAẠaạEẸeẹIỊiịOỌoọƠỢơợUỤuụƯỰưự"
     U"YỴyỵ"},
    {U'\u0324',
     U"UṲuṳ"},
    {U'\u0325',
     U"AḀaḁ"},
    {U'\u0326',
     U"SȘsșTȚtț"},
    {U'\u0327',
     U"CÇcçGĢgģKĶkķLĻlļNŅnņRŖrŗSŞsşTŢtţEȨeȩDḐdḑHḨhḩ"},
    {U'\u0328',
     U"AĄaąEĘeęIĮiįUŲuųOǪoǫ"},
    {U'\u032d',
     U"DḒdḓEḘeḙLḼlḽNṊnṋTṰtṱUṶuṷ"},
    {U'\u032e',
     U"HḪhḫ"},
    {U'\u0330',
     U"EḚeḛIḬiḭUṴuṵ"},
    {U'\u0331',
     U"BḆbḇDḎdḏKḴkḵLḺlḻNṈnṉRṞrṟTṮtṯZẔzẕhẖ"},
    {U'\u0338',
     U"←↚→↛↔↮⇐⇍⇔⇎⇒⇏∃∄∈∉∋∌∣∤∥∦∼≁≃≄≅≇≈≉=≠≡≢≍≭<≮>≯≤≰≥≱≲≴≳≵≶≸≷≹≺⊀≻⊁⊂⊄⊃⊅⊆⊈⊇⊉⊢⊬⊨⊭⊩⊮⊫⊯≼⋠≽⋡⊑⋢⊒⋣"
     U"⊲⋪⊳⋫⊴⋬⊵⋭"},
    {U'\u0342',
     U"ἀἆἁἇἈἎἉἏἠἦἡἧἨἮἩἯἰἶἱἷἸἾἹἿὐὖὑὗὙὟὠὦὡὧὨὮὩὯαᾶ¨῁ηῆ᾿῏ιῖϊῗ῾῟υῦϋῧωῶ"},
    {U'\u0345',
     U"ἀᾀἁᾁἂᾂἃᾃἄᾄἅᾅἆᾆἇᾇἈᾈἉᾉἊᾊἋᾋἌᾌἍᾍἎᾎἏᾏἠᾐἡᾑἢᾒἣᾓἤᾔἥᾕἦᾖἧᾗἨᾘἩᾙἪᾚἫᾛἬᾜἭᾝἮᾞἯᾟὠᾠὡᾡὢᾢὣᾣὤᾤὥᾥὦᾦὧᾧ"
     U"ὨᾨὩᾩὪᾪὫᾫὬᾬὭᾭὮᾮὯᾯὰᾲαᾳάᾴᾶᾷΑᾼὴῂηῃήῄῆῇΗῌὼῲωῳώῴῶῷΩῼ"},
    {U'\u3099',
     U"かがきぎくぐけげこごさざしじすずせぜそぞただちぢつづてでとどはばひびふぶへべほぼうゔゝゞカガキギクグケゲコゴサザシジスズセゼソゾタダチヂツヅテデトドハバヒビフブ"
     U"ヘベホボウヴワヷヰヸヱヹヲヺヽヾ"},
    {U'\u309a',
     U"はぱひぴふぷへぺほぽハパヒピフプヘペホポ"},
};
// clang-format on

// Returns the letter that is written as `letter` followed by `mark`; 0: there is none.
char32_t pair(char32_t letter, char32_t mark) {
  // Korean syllables are numbered by their parts (The Unicode Standard, section 3.12).
  constexpr char32_t kLead = 0x1100, kVowel = 0x1161, kTail = 0x11a7, kFirst = 0xac00;
  constexpr char32_t kLeads = 19, kVowels = 21, kTails = 28;
  if (letter - kLead < kLeads && mark - kVowel < kVowels)
    return kFirst + ((letter - kLead) * kVowels + mark - kVowel) * kTails;
  const char32_t syllable = letter - kFirst;
  if (syllable < kLeads * kVowels * kTails && syllable % kTails == 0 && mark > kTail && mark < kTail + kTails)
    return letter + mark - kTail;
  const auto* of = std::ranges::find(kMarks, mark, &Mark::mark);
  if (of == std::end(kMarks)) return 0;
  for (std::size_t i = 0; i < of->letters.size(); i += 2)
    if (of->letters[i] == letter) return of->letters[i + 1];
  return 0;
}

// Removes the first code point from the front of `text` and returns it. Returns a number above 0x10ffff, and
// removes one byte, if it is not UTF-8.
char32_t next_point(std::string_view& text) {
  const auto first = static_cast<unsigned char>(text[0]);
  const std::size_t length = first < 0x80       ? 1
                             : first >> 5 == 6  ? 2
                             : first >> 4 == 14 ? 3
                             : first >> 3 == 30 ? 4
                                                : 0;
  char32_t point = length == 1 ? first : length == 0 ? 0 : first & (0x7f >> length);
  bool good = length > 0 && length <= text.size();
  for (std::size_t i = 1; good && i < length; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    good = byte >> 6 == 2;
    point = point << 6 | (byte & 0x3f);
  }
  text.remove_prefix(good ? length : 1);
  return good ? point : 0x110000 + first;
}

void append(std::string& out, char32_t point) {
  const auto byte = [&](char32_t b) { out += static_cast<char>(b); };
  if (point > 0x10ffff) return byte(point - 0x110000);
  if (point < 0x80) return byte(point);
  if (point < 0x800) return byte(0xc0 | point >> 6), byte(0x80 | (point & 0x3f));
  if (point < 0x10000) {
    byte(0xe0 | point >> 12);
  } else {
    byte(0xf0 | point >> 18);
    byte(0x80 | (point >> 12 & 0x3f));
  }
  byte(0x80 | (point >> 6 & 0x3f));
  byte(0x80 | (point & 0x3f));
}

// Returns the only entry of `folder` whose name is `name` if both are composed.
std::optional<fs::path> alike(const fs::path& folder, const fs::path& name) {
  const std::string wanted = composed(name.string());
  std::optional<fs::path> found;
  std::error_code error;
  fs::directory_iterator it(folder, fs::directory_options::skip_permission_denied, error);
  for (std::size_t n = 0; !error && it != fs::directory_iterator() && n < kMaxNamesLookedAt;
       it.increment(error), ++n)
    if (composed(it->path().filename().string()) == wanted) {
      if (found) return std::nullopt;
      found = it->path();
    }
  return found;
}

}  // namespace

std::string composed(std::string_view name) {
  std::u32string points;
  while (!name.empty()) {
    const char32_t point = next_point(name), both = points.empty() ? 0 : pair(points.back(), point);
    if (both)
      points.back() = both;
    else
      points += point;
  }
  std::string out;
  for (const char32_t point : points) append(out, point);
  return out;
}

std::string with_slashes(std::string_view name) {
  std::string out(name);
  std::ranges::replace(out, '\\', '/');
  return out;
}

std::optional<fs::path> written_otherwise(const fs::path& folder, std::string_view name) {
  fs::path place = folder.empty() ? fs::path(".") : folder;
  std::error_code error;
  for (const fs::path& part : fs::path(with_slashes(name))) {
    const fs::path next = place / part;  // an absolute name begins with its root, which replaces the place
    if (fs::exists(next, error)) {
      place = next;
      continue;
    }
    const auto other = alike(place, part);
    if (!other) return std::nullopt;
    place = *other;
  }
  return place;
}

}  // namespace ls
