'use strict';
(() => {
    const list = document.getElementById('materials'), which = document.getElementById('method');
    const buttons = document.querySelectorAll('#sort button'), page = document.body.dataset;
    let failed = 0;

    addEventListener('error', () => { failed++; }, true);
    addEventListener('securitypolicyviolation', () => { failed++; });

    function sortBy(key, down) {
        const at = which ? which.value : 0;
        const value = article => {
            const v = article.getAttribute('data-' + key + (at > 0 ? '-' + at : ''));
            return v ? Number(v) : -Infinity;
        };
        list.append(...[...list.children].sort((a, b) => (down ? -1 : 1) * (value(a) - value(b))));
        page.sorted = key;
        page.order = down ? 'down' : 'up';
        for (const b of buttons) b.setAttribute('aria-pressed', b.dataset.key === key);
    }

    for (const b of buttons)
        b.addEventListener('click', () =>
            sortBy(b.dataset.key, page.sorted !== b.dataset.key || page.order !== 'down'));
    if (which) which.addEventListener('change', () => sortBy(page.sorted || 'render', page.order !== 'up'));

    addEventListener('load', () => {
        for (const i of document.images) if (!i.complete || !i.naturalWidth) failed++;
        const b = [...buttons].find(one => '#' + one.dataset.key === location.hash);
        if (b) b.click();
        page.failed = failed;
    });
})();
