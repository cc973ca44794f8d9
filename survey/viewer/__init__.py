"""`survey view`: a map in the browser, served to this machine only (needs the extra `view`).

shown.py    a survey's file and a view of it: the link, what is known about a point
raster.py   a window of the map -> pixels
page.py     the page in the browser
widgets.py  its pieces of HTML and bokeh models
server.py   the server, for whoever has its token
"""
