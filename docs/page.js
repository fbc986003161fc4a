// Code and tables that scroll are reached by keyboard, and the bar of buttons is no landmark; the theme changes both as it draws.
const SCROLLS = ":is(pre > code, .md-typeset__scrollwrap):not([tabindex])";
const reach = () => {
  for (const bar of document.querySelectorAll("nav.md-code__nav:not([role])")) bar.setAttribute("role", "presentation");
  for (const box of document.querySelectorAll(SCROLLS)) box.setAttribute("tabindex", "0");
};
new MutationObserver(reach).observe(document.body, {
  childList: true, subtree: true, attributes: true, attributeFilter: ["tabindex"],
});
reach();
