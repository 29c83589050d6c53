"""Put cores on boards, and talk to them."""
