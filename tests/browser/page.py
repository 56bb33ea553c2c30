"""The pages in a browser; ends with what is wrong.

python3 page.py view FOLDER...       each has a view.html and a preview.png
python3 page.py index FILE NAME...   an index.html, and the materials that it has to have
python3 page.py report FILE...       lgd-eval's
"""
import os
import sys
import tempfile

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import png  # noqa: E402
from browser import Browser  # noqa: E402

LIMIT = 0.004  # browsers differ from the C renderer by 0.002, one wrong factor in G by 0.006
READY = ("new Promise((done, fail) => { const begun = Date.now(), timer = setInterval(() => { "
         "if (document.body.dataset.ready) { clearInterval(timer); done(); } "
         "else if (Date.now() - begun > 60000) fail(new Error('not ready: ' + document.body.innerText)); }, 10); })")


def check(fine, what, *more):
    if not fine:
        sys.exit(what % more if more else what)


class Shot:
    """Pictures of the page now, to be compared."""

    def __init__(self, browser):
        self.browser, self.folder = browser, tempfile.mkdtemp()

    def __call__(self):
        path = os.path.join(self.folder, "now.png")
        self.browser.picture(path)
        with open(path, "rb") as f:
            return f.read()


def opened(b, path):
    b.open(path)
    b.run(READY)


def equals_preview(b, folder):
    want = os.path.join(folder, "preview.png")
    width, height = png.read(want)[:2]
    b.screen(width, height)
    opened(b, folder + "/view.html#preview")
    got = os.path.join(tempfile.mkdtemp(), "preview.png")
    b.picture(got)
    error = png.rmse(got, want)
    print("%s: %d x %d, RMSE %.4f" % (os.path.basename(folder), width, height, error))
    check(error < LIMIT, "%s: RMSE %.4f from preview.png", folder, error)


def set_field(b, name, value):
    b.run("{ const f = document.querySelector('[name=%s]'); f.value = '%s'; "
          "f.dispatchEvent(new Event('input', { bubbles: true })); }" % (name, value))


def box(b, which):
    return b.run("(r => [r.left, r.top, r.width, r.height])(document.querySelector('%s').getBoundingClientRect())" %
        which)


def is_used(b, path):
    """Mouse, keys and sliders change the picture, and hold does not."""
    shot = Shot(b)
    b.screen(900, 700)
    opened(b, path)
    x, y, w, h = box(b, "#canvas")
    seen = [shot()]

    def changes(what, expected=True):
        now = shot()
        check((now != seen[-1]) == expected, "%s %s the picture", what, "does not change" if expected else "changes")
        seen.append(now)

    b.mouse("mouseMoved", x + w / 4, y + h / 2)
    changes("the mouse")
    b.mouse("mousePressed", x + w / 2, y + h / 2)
    b.mouse("mouseReleased", x + w / 2, y + h / 2)
    changes("a click")
    check(not b.run("document.querySelector('[name=follow]').checked"), "a click does not hold the light")
    b.mouse("mouseMoved", x + w / 4, y + h / 3)
    changes("the mouse while the light is held", False)
    for key in ("ArrowLeft", "ArrowUp", "+", "PageDown"):
        b.key(key, key if len(key) == 1 else "")
        changes(key)
    b.key(" ", " ")
    check(b.run("document.querySelector('[name=follow]').checked"), "space does not let go of the light")
    for name, value in (("height", 1.5), ("stops", 1), ("ambient", 0.3), ("roughness", 0.4), ("relief", 2),
        ("show", "normal"),
                        ("show", "roughness"), ("other", "photo"), ("split", 0.25)):
        set_field(b, name, value)
        changes(name)
    seam = box(b, "#seam")
    b.mouse("mousePressed", seam[0], y + h / 2)
    b.mouse("mouseMoved", x + 0.75 * w, y + h / 2)
    b.mouse("mouseReleased", x + 0.75 * w, y + h / 2)
    changes("the divider")
    check(abs(float(b.run("document.querySelector('[name=split]').value")) - 0.75) < 0.01,
          "the divider is not where it was put")
    b.run("document.querySelector('[value=sphere]').click()")
    changes("the sphere")
    check(box(b, "#canvas") == [x, y, w, h], "the picture has moved: %s", box(b, "#canvas"))
    b.run("document.querySelector('[type=reset]').click()")
    b.settle()
    b.mouse("mouseMoved", 1, 1)
    b.run("document.activeElement.blur()")
    check(shot() == seen[0], "the page does not go back to its start")


def fits_a_phone(b, path):
    shot = Shot(b)
    b.screen(360, 640, 2, True)
    opened(b, path)
    check(b.run("document.documentElement.scrollWidth") == 360, "wider than a phone: %s",
          b.run("document.documentElement.scrollWidth"))
    x, y, w, h = box(b, "#canvas")
    before = shot()
    b.touch("touchStart", (x + w / 3, y + h / 2))
    b.touch("touchMove", (x + w / 2, y + h / 4))
    b.touch("touchEnd")
    check(shot() != before, "a finger does not move the light")
    check(b.run("scrollY") == 0, "a finger on the picture scrolls the page")
    small = b.run("[...document.querySelectorAll('button, select, .choice span')].filter(e => "
                  "e.getBoundingClientRect().height < 34).map(e => e.textContent)")
    check(not small, "too small for a finger: %s", small)


def without(b, path):
    """No WebGL 2, then no JavaScript: the page says so and shows the pictures."""
    b.screen(800, 600)
    script = b.call("Page.addScriptToEvaluateOnNewDocument",
                    source="HTMLCanvasElement.prototype.getContext = () => null;")["identifier"]
    b.open(path)
    shown = "[...document.querySelectorAll('#still img')].filter(i => i.getBoundingClientRect().width > 100).length"
    check("no WebGL 2" in b.run("document.body.innerText"), "nothing is said without WebGL 2")
    check(b.run(shown) == 3 and box(b, "#tool")[2] == 0, "the pictures are not shown without WebGL 2")
    b.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script)
    b.call("Emulation.setScriptExecutionDisabled", value=True)
    b.call("Page.navigate", url="file://" + path)
    for _ in range(200):
        if b.run("document.readyState") == "complete" and b.run(shown) == 3:
            break
    text = b.run("document.body.innerText")
    check("needs JavaScript" in text, "nothing is said without JavaScript: %s", text)
    check(b.run(shown) == 3 and box(b, "#tool")[2] == 0, "the pictures are not shown without JavaScript")
    b.call("Emulation.setScriptExecutionDisabled", value=False)


def silent(b, path):
    """What the page and the browser had to say; and that it would have been heard."""
    check(not b.console, "console: %s", "; ".join(b.console))
    with tempfile.NamedTemporaryFile("w", suffix=".html") as f:
        with open(path, encoding="utf-8") as page:
            f.write(page.read().replace("</body>", "<img src=\"http://127.0.0.1:9/x.png\"></body>"))
        f.flush()
        b.open(f.name)
    b.settle()
    check(b.console, "a page that loads something goes unnoticed")


def regains(b, path):
    """Browsers take the graphics away and give them back."""
    shot = Shot(b)
    b.screen(900, 700)
    opened(b, path)
    set_field(b, "relief", 2)
    before = shot()
    b.run("new Promise(done => { const c = document.getElementById('canvas'), "
          "e = c.getContext('webgl2').getExtension('WEBGL_lose_context'); "
          "c.addEventListener('webglcontextlost', () => setTimeout(() => e.restoreContext())); "
          "c.addEventListener('webglcontextrestored', () => setTimeout(done)); e.loseContext(); })")
    check(shot() == before, "the picture is another once the graphics are back")


def view(b, *folders):
    for each in folders:
        equals_preview(b, each)
    first = os.path.join(folders[0], "view.html")
    is_used(b, first)
    fits_a_phone(b, first)
    without(b, first)
    silent(b, first)
    regains(b, first)


def narrow(b, path):
    """At a phone's width nothing but what scrolls by itself is wider."""
    b.screen(360, 640, 2, True)
    b.open(path)
    b.settle()
    check(b.run("document.documentElement.scrollWidth") == 360, "%s is %s wide on a phone", path,
          b.run("document.documentElement.scrollWidth"))
    check(not b.console, "console: %s", "; ".join(b.console))


def report(b, *paths):
    """Pictures have as many names of columns and rows as panels, each above or beside its own."""
    for path in paths:
        narrow(b, path)
        sheets = b.run("""[...document.querySelectorAll('.sheet')].map(s => {
            const i = s.querySelector('img'), box = i.getBoundingClientRect();
            const column = s.querySelectorAll('.columns span'), row = s.querySelectorAll('.rows span');
            const panel = box.width / column.length, place = e => e.getBoundingClientRect();
            const off = (at, k) => Math.abs(at - (k + 0.5) * panel);
            return { square: Math.abs(box.height / row.length - panel) < 1,
                names: [...column, ...row].map(e => e.textContent),
                fine: [...column].every((e, k) => off(place(e).left + place(e).width / 2 - box.left, k) < 2) &&
                    [...row].every((e, k) => off(place(e).top + place(e).height / 2 - box.top, k) < 3) };
        })""")
        check(sheets, "%s has no pictures", path)
        for s in sheets:
            check(s["square"] and s["fine"], "%s: names that are not where their panels are: %s", path, s["names"])
            check(all(s["names"]), "%s: a panel without a name: %s", path, s["names"])


def index(b, path, *names):
    """Every material has a card with its name, and its link leads to its page."""
    narrow(b, path)
    cards = b.run("[...document.querySelectorAll('a.card')].map(a => [a.querySelector('h2').textContent, a.href, "
                  "a.querySelector('img').naturalWidth])")
    check([c[0] for c in cards] == list(names), "cards: %s", cards)
    for name, address, width in cards:
        check(width > 0, "%s: no picture", name)
        opened(b, address[len("file://"):])
        check(b.run("document.querySelector('h1').textContent") == name, "%s leads to another page", name)
    check(not b.console, "console: %s", "; ".join(b.console))


b = Browser()
try:
    {"view": view, "report": report, "index": index}[sys.argv[1]](
        b, *(os.path.abspath(a) if os.path.exists(a) else a for a in sys.argv[2:]))
finally:
    b.close()
