#include "common/report/job_sections.h"

namespace ls::report {

std::string_view page_css() {
  return R"(
:root{--paper:#fffdf9;--card:#fff;--ink:#2b2a27;--soft:#6a675f;--edge:#e5dfd2;--light:#a55c14;--good:#2c7a4b;--warn:#93560a;--veil:#fdf3e2;--bad:#a8321f;
--t0:#8a7a12;--t1:#8e4fa8;--t2:#c0701c;--t3:#2a6fb0;--t4:#2c7a4b;--t5:#c9c3b6;--beam:#e9a94f}
@media (prefers-color-scheme:dark){:root{--paper:#0f1116;--card:#14171d;--ink:#ece9e2;--soft:#a3a8b3;--edge:#2a303b;--light:#ffe3b3;--good:#93d2a6;--warn:#f2b45c;--veil:#1f1b14;--bad:#ff9482;
--t0:#d6e36b;--t1:#c9a7ff;--t2:#f4c27a;--t3:#7cc4ff;--t4:#8fdca0;--t5:#4a5161;--beam:#f4c27a}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:var(--paper);color:var(--ink);font:400 16px/1.55 Inter,"Segoe UI","Helvetica Neue",Cantarell,"Noto Sans",system-ui,"DejaVu Sans",sans-serif}
main{max-width:1080px;margin:0 auto;padding:clamp(1rem,4vw,3rem) clamp(1rem,4vw,2.5rem) 4rem}
h1{margin:.2rem 0 0;font-size:clamp(1.6rem,4.5vw,2.4rem);font-weight:400;letter-spacing:-.02em;line-height:1.15;overflow-wrap:anywhere}
h2{margin:0 0 1rem;font-size:1.15rem;font-weight:500;letter-spacing:-.01em}
h3{margin:0 0 .5rem;font-size:.85rem;font-weight:600;color:var(--soft)}
p,dl,dd,figure,ul{margin:0;padding:0}
header{margin-bottom:1.75rem}
.brand{display:flex;align-items:center;gap:.5rem;color:var(--soft);font-size:.85rem}
.brand svg{width:1.5rem;height:1.5rem}.beam{fill:var(--beam);opacity:.35}.window{fill:var(--beam)}
.sub,.note,.why,small,figcaption{color:var(--soft)}.sub{margin-top:.35rem}
section{margin-top:2.75rem;padding-top:1.5rem;border-top:1px solid var(--edge)}
.image{background:#050608;border-radius:10px;overflow:hidden;text-align:center;line-height:0}
.image img{width:100%;max-height:80vh;object-fit:contain}
.map img{width:100%;border-radius:8px;background:#050608}
.legend{display:flex;align-items:center;gap:.7rem;margin-top:.3rem;font-variant-numeric:tabular-nums}.ramp{flex:1;height:.6rem;border-radius:3px}
.map figcaption b{color:var(--ink);font-weight:500;text-transform:capitalize}
figcaption{font-size:.85rem;margin:.35rem 0}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,24rem),1fr));gap:1.25rem 2rem;margin-top:1.25rem}
section .pair{margin-top:0}
.figures{display:grid;grid-template-columns:repeat(auto-fit,minmax(9.5rem,1fr));gap:1.25rem 1.5rem;margin-top:2rem}
.figures dt{color:var(--soft);font-size:.8rem}
.figures b{display:block;font-weight:500;font-variant-numeric:tabular-nums;white-space:nowrap}
.figures .key b{font-size:1.75rem;font-weight:400;letter-spacing:-.02em;line-height:1.3;color:var(--light)}
.figures small{display:block;font-size:.8rem}
.lesser{margin-top:1.5rem;padding-top:1.25rem;border-top:1px solid var(--edge)}
.verdict{margin-top:1.5rem;padding:.8rem 1.1rem;border:1px solid var(--warn);border-radius:8px;background:var(--veil);color:var(--warn)}
.failure{margin:1.5rem 0;padding:.8rem 1.1rem;border:1px solid var(--bad);border-radius:8px}.failure b{color:var(--bad);font-weight:500}
caption{caption-side:bottom;text-align:left;color:var(--soft);padding-top:.5rem}
.note{margin-top:.9rem;font-size:.92rem}.note b{color:var(--ink);font-weight:500}
.good{color:var(--good)}.bad h2{color:var(--bad)}
table{border-collapse:collapse;font-size:.9rem;font-variant-numeric:tabular-nums}
th,td{padding:.3rem 1.4rem .3rem 0;text-align:left;white-space:nowrap;font-weight:400}
thead th{color:var(--soft);font-size:.8rem}tbody tr{border-top:1px solid var(--edge)}
.wide{overflow-x:auto}details{margin-top:1rem}summary{cursor:pointer;color:var(--light)}
summary:focus-visible{outline:2px solid var(--light);outline-offset:3px;border-radius:3px}
.bar{display:block;width:100%;height:26px;border-radius:6px;margin-bottom:1rem}
.swatch{width:.75rem;height:.75rem;margin-right:.55rem}
.t0{fill:var(--t0)}.t1{fill:var(--t1)}.t2{fill:var(--t2)}.t3{fill:var(--t3)}.t4{fill:var(--t4)}.t5{fill:var(--t5)}
.split .why{white-space:normal}
ul{list-style:none}.complaints li{padding:.5rem 0;overflow-wrap:anywhere}
.features{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,24rem),1fr));gap:1.5rem 2rem}
.parts{font-size:.92rem}.parts li{padding:.15rem 0}.parts .why{font-size:.85rem}.parts .why::before{content:"· "}.out li{color:var(--soft)}.spaced{margin-bottom:1.5rem}
.rows div{display:grid;grid-template-columns:10rem 1fr;gap:.2rem 1rem;padding:.35rem 0;border-top:1px solid var(--edge);font-size:.92rem}
.rows div:first-child{border:0}.rows dt{color:var(--soft)}
code,pre{font-family:"JetBrains Mono","SF Mono","Noto Sans Mono",ui-monospace,"DejaVu Sans Mono",monospace;font-size:.85em;overflow-wrap:anywhere}
pre{white-space:pre-wrap;margin:.5rem 0 0}
.unseen{position:absolute;width:1px;height:1px;overflow:hidden;clip-path:inset(50%)}
@media (max-width:36rem){.rows div{grid-template-columns:1fr}.split .why{display:none}.figures{grid-template-columns:1fr 1fr}.figures .key b{font-size:1.4rem}}
@media print{body{font-size:12px}section{break-inside:avoid}.image img{max-height:14cm}}
)";
}

}  // namespace ls::report
