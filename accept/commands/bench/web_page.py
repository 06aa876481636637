"""Additions to the page of `accept run --web` beside the terminal: keys for gloves, and photos that are dropped."""

UPLOAD = "/photo"  # takes a dropped or pasted file, answers with its path

_KEYS = (  # what stands on it, the key of the browser, its code; ^: with Ctrl
    ("Esc", "Escape", 27),
    ("←", "ArrowLeft", 37),
    ("↑", "ArrowUp", 38),
    ("↓", "ArrowDown", 40),
    ("→", "ArrowRight", 39),
    ("PgUp", "PageUp", 33),
    ("PgDn", "PageDown", 34),
    ("Tab", "Tab", 9),
    ("⌫", "Backspace", 8),
    *((f"F{n}", f"F{n}", 111 + n) for n in (*range(1, 11), 12)),
    *((f"^{letter}", letter, ord(letter.upper())) for letter in "zrdflsotekp"),
    ("Enter", "Enter", 13),
)
_STYLE = """<style>
body { margin: 0; height: 100vh; display: flex; flex-direction: column; }
#terminal { flex: 1; min-height: 0; height: auto !important; }
#touch { display: flex; flex-wrap: wrap; gap: 4px; padding: 2px; z-index: 5; }  /* further rows in a narrow window */
#touch button { flex: 1 0 48px; height: 52px; margin: 0; padding: 0; background: #1f2937; color: #dfe6ef;
  font: 16px monospace; border: 0; border-radius: 6px; touch-action: manipulation; }
#touch button:active { background: #6cb6ff; }
#touch button[data-key=Enter] { flex-grow: 2; background: #2b4a6f; }
</style>
"""
_SCRIPT = """<script>
const line = () => document.querySelector("textarea.xterm-helper-textarea");
function press(key, code, ctrlKey) {
  const event = new KeyboardEvent("keydown", { key, code: key, ctrlKey, bubbles: true, cancelable: true });
  Object.defineProperty(event, "keyCode", { get: () => code });
  Object.defineProperty(event, "which", { get: () => code });
  line()?.focus();
  line()?.dispatchEvent(event);
}
document.querySelectorAll("#touch button").forEach((button) => {
  button.addEventListener("pointerdown", (event) => {
    event.preventDefault();  // the terminal keeps the focus
    press(button.dataset.key, Number(button.dataset.code), button.textContent.startsWith("^"));
  });
});
async function take(files, event) {
  if (!files || !files.length) return;
  event.preventDefault();
  event.stopPropagation();
  const name = encodeURIComponent(files[0].name || "photo.png");
  const answer = await fetch("UPLOAD?name=" + name, { method: "POST", body: files[0] });
  if (!answer.ok) return;
  const pasted = new DataTransfer();
  pasted.setData("text/plain", await answer.text());
  line()?.focus();
  line()?.dispatchEvent(new ClipboardEvent("paste", { clipboardData: pasted, bubbles: true, cancelable: true }));
}
document.addEventListener("dragover", (event) => event.preventDefault(), true);
document.addEventListener("drop", (event) => take(event.dataTransfer.files, event), true);
document.addEventListener("paste", (event) => take(event.clipboardData.files, event), true);
</script>
""".replace("UPLOAD", UPLOAD)


def additions() -> str:
    """Return the HTML to put before `</body>`: style, a bar of touch keys, and the script for keys and photos."""
    keys = "".join(
        f'<button tabindex="-1" data-key="{key}" data-code="{code}">{label}</button>' for label, key, code in _KEYS
    )
    return f'{_STYLE}<div id="touch">{keys}</div>\n{_SCRIPT}'
