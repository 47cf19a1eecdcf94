"""The application: assembly, middleware, authorization, error answers, WebSockets and static files."""
